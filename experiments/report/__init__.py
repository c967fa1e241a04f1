"""The study's report: findings drawn from its tables, put into words, tables and one self-contained page."""
