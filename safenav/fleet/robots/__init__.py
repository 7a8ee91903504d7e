"""The robots of a fleet: their state, their sensors, their actions."""
