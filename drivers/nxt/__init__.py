"""The LEGO MINDSTORMS NXT brick: telegrams, the line to it, the driver."""
