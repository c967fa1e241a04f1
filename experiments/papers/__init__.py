"""The three papers, row by row: what is printed, what we find, and one rule that says whether it came back."""
