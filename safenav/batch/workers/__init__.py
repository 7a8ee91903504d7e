"""Local workers for cases: processes that can be ended."""
