//! Empty: the package is its tests, and the programs that they start.
