"""Duties of the robots, the requests behind them, and needs that no robot fulfils."""
