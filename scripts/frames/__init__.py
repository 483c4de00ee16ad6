"""Random planar frames, and an independent frame solver to compare the command with (scripts/random-frames)."""
