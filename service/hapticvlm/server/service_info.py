"""The address where the service listens, and what `welcome` reports of its parts."""

from __future__ import annotations

from hapticvlm.messages import Device, Devices, Models
from hapticvlm.server.access import Address
from hapticvlm.server.assemble import ServiceParts
from hapticvlm.server.handshake import ServiceInfo
from hapticvlm.server.settings import ServeOptions
from hapticvlm.server.web import certificate
from hapticvlm.server.web.certificate import Certificate


def address(serving: ServeOptions) -> Address:
    """Return where to listen and whom to let in. Raises ValueError."""
    return Address(
        serving.host,
        serving.port,
        serving.token,
        frozenset(serving.allow_origin),
        serving.scene,
        _certificate(serving),
        serving.pages_from,
    )


def _certificate(serving: ServeOptions) -> Certificate | None:
    if serving.tls_cert is None and serving.tls_key is None:
        return None
    if serving.tls_cert is None or serving.tls_key is None:
        raise ValueError("--tls-cert and --tls-key go together: state both")
    return certificate.load(serving.tls_cert, serving.tls_key)


def service_info(serving: ServeOptions, parts: ServiceParts) -> ServiceInfo:
    """Return what `welcome` reports of these parts, once they have started."""
    loaded = parts.recogniser.loaded
    vlm = None if parts.vlm is None else parts.vlm.settings.model
    return ServiceInfo(
        devices(parts),
        Models(encoder=loaded.encoder, gallery=loaded.gallery, vlm=vlm),
        parts.table,
        asks_elsewhere=serving.vlm_url is not None,
        crops_elsewhere=serving.recogniser_url is not None,
        recorder=parts.recorder,
        saved_materials=parts.saved_materials,
        contact_resistance=serving.contact_resistance,
        plate_resistance=serving.plate_resistance,
    )


def devices(parts: ServiceParts) -> Devices:
    """Return the outputs and which of them are simulated."""
    return Devices(
        speaker=Device(name=parts.speaker.name, simulated=parts.speaker.simulated),
        peltier=Device(name=parts.plate.name, simulated=parts.plate.simulated),
    )
