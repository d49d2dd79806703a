//! Pictures of a match.
