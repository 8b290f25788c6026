//! stub: see brief
