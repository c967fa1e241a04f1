"""Models, filters, smoothers, system identification, and the tests that say whether to believe them."""
