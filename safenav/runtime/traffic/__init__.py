"""Traffic on a shared floor: triggers, search and execution of joint plans."""
