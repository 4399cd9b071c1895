from hapticvlm import materials as materials
from hapticvlm.errors import HapticVLMError as HapticVLMError
from hapticvlm.materials import MATERIALS as MATERIALS
from hapticvlm.vision.picture_recogniser import PictureRecogniser as PictureRecogniser
from hapticvlm.vision.picture_recogniser import RecognisedPicture as RecognisedPicture
from hapticvlm.vision.picture_recogniser import recognise as recognise
from hapticvlm_studio.touches.felt import FeltTouch as FeltTouch
from hapticvlm_studio.touches.felt import feel as feel

__version__: str
__all__ = [
    "MATERIALS",
    "FeltTouch",
    "HapticVLMError",
    "PictureRecogniser",
    "RecognisedPicture",
    "feel",
    "materials",
    "recognise",
]
