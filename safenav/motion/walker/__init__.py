"""A biped as a prismatic inverted pendulum that steps: gait, primitives."""
