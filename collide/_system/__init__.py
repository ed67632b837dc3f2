"""What differs by operating system: threads and locks, forks, memory, whose files are whose, an orderly start."""
