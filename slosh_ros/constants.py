"""Constants of nature."""

GRAVITY = 9.81  # [m/s^2] throughout, as in the paper
NANOSECONDS = 1_000_000_000  # in a second
