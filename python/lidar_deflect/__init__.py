"""Large 3D deflections of wind turbine blades from the raw packets of several lidars."""
