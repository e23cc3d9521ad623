"""The table of trials: what is asked, who runs it, what is printed and written."""
