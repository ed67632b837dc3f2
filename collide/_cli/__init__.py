"""What only the command line needs: the demo, and the memory limit that it shows."""
