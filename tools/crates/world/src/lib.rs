//! Pitch, physics, referee and the two-eye renderer.
