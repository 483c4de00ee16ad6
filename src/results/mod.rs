//! Results as files: tables, ngspice `.raw`, CSV, pictures.
