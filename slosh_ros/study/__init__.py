"""Pictures, the demo, and the paper's cases."""
