"""`Record`, and every door through which a log comes in or goes out."""
