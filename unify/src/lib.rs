//! Holds no code: its manifest turns on the same features of shared dependencies in every build (see README.md).
