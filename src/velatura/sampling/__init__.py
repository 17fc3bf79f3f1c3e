"""Functions sampled over directions, and the numbers to sample with."""
