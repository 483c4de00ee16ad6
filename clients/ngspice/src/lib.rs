//! ngspice XSPICE code model for Bimorph.
