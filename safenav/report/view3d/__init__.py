"""The 3D page: a run in metres and seconds."""
