"""A scenario whose robot counts: its objective has a memory of its own."""

COUNTING = """
safenav: 1
map: {grid: ["...", "..."]}
robots:
  q:
    model: quadcopter
    start: 0
    objective:
      ltl:
        memory: {n: [0, 3], seen: bool}
        init: n = 0
        safety: ["n' = n | region = 5 & n < 3 & n' = n + 1 | n = 3 & n' = 0", "seen' -> seen'"]
        liveness: [n = 3, region = 3]
"""
