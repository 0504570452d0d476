//! Helpers that several of the tests use.
