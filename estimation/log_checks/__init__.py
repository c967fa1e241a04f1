"""What a log tells of its own sensors: noise, outliers, gaps, frozen or clipped channels."""
