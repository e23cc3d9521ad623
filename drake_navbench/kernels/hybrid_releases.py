"""The releases of Nav2 by whose rules Hybrid-A* searches: the minor versions of its packages."""

HUMBLE, IRON, JAZZY, KILTED, LYRICAL = 1, 2, 3, 4, 5
