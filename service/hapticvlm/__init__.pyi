from hapticvlm import materials as materials
from hapticvlm.client.blocking import BlockingClient as BlockingClient
from hapticvlm.client.blocking import connect_blocking as connect_blocking
from hapticvlm.client.connection import Client as Client
from hapticvlm.client.connection import Refused as Refused
from hapticvlm.client.connection import TouchEnded as TouchEnded
from hapticvlm.client.connection import connect as connect
from hapticvlm.client.local_service import Service as Service
from hapticvlm.client.local_service import serve as serve
from hapticvlm.errors import HapticVLMError as HapticVLMError
from hapticvlm.materials import MATERIALS as MATERIALS
from hapticvlm.scenes.scanned_scene import ScannedScene as ScannedScene
from hapticvlm.scenes.scanned_scene import scan as scan
from hapticvlm.touches.felt import FeltTouch as FeltTouch
from hapticvlm.touches.felt import feel as feel
from hapticvlm.vision.picture_recogniser import PictureRecogniser as PictureRecogniser
from hapticvlm.vision.picture_recogniser import RecognisedPicture as RecognisedPicture
from hapticvlm.vision.picture_recogniser import recognise as recognise

__version__: str
__all__ = [
    "MATERIALS",
    "BlockingClient",
    "Client",
    "FeltTouch",
    "HapticVLMError",
    "PictureRecogniser",
    "RecognisedPicture",
    "Refused",
    "ScannedScene",
    "Service",
    "TouchEnded",
    "connect",
    "connect_blocking",
    "feel",
    "materials",
    "recognise",
    "scan",
    "serve",
]
