//! Empty: the package is its tests, and the gallery of their scenes.
