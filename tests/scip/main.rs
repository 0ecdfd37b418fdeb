//! The SCIP reader: replies of real sensors, vectors of the specification, damaged and arbitrary bytes.

mod reader;
mod spec;
