"""Nav2's behaviour tree for NavigateToPose as a py_trees tree that lives in a Drake Context."""
