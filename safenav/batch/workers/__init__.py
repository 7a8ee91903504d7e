"""Where cases run on this machine: processes that can be ended."""
