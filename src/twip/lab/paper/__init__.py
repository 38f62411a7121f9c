"""The paper's experiments, one module per figure: each runs the robot's SSP, draws a picture and checks claims."""
