"""What goes wrong at the door, as one family of exceptions whose message is written for the user."""


class HydrostateError(ValueError):
    """A user's input cannot be used; the message says what, what was wanted, and what came."""


class LogError(HydrostateError):
    """A log file cannot be read or trusted."""


class RigError(HydrostateError):
    """A rig file, or a parameter in it, is not usable."""


class DriveError(HydrostateError):
    """A drive signal exceeds what the actuator can do, or its description is unusable."""


class LogWarning(UserWarning):
    """A log was accepted, with something the reader should know."""


class CovarianceWarning(LogWarning):
    """A model was fitted whose covariance says too little; what it predicts is not affected."""
