//! stub main; replaced by the command line.
fn main() {}
