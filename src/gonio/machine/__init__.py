"""What this process takes of the machine: memory and its lid, a thread to wait for, a Python of its own."""
