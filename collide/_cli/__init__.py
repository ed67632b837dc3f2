"""What only the command line needs: an orderly start, the demo and its memory limit."""
