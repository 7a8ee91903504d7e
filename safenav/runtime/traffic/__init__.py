"""Traffic on a shared floor: joint plans, their execution, and when one is needed."""
