"""The three papers, row by row: the printed value, our result, and one rule that decides whether it was reproduced."""
