"""What a bench would have measured: noise, quantisation, rate, and sensors that fail."""
