"""The address where the service listens, and what `welcome` reports of its parts."""

from __future__ import annotations

from hapticvlm.messages import Device, Devices, Models
from hapticvlm.server.access import Address
from hapticvlm.server.assemble import ServiceParts
from hapticvlm.server.handshake import ServiceInfo
from hapticvlm.server.settings import ServeOptions
from hapticvlm.server.web import certificate
from hapticvlm.server.web.certificate import Certificate


def address(options: ServeOptions) -> Address:
    """Return where to listen and whom to let in. Raises ValueError."""
    return Address(
        options.host,
        options.port,
        options.token,
        frozenset(options.allow_origin),
        options.scene,
        _certificate(options),
        options.pages_from,
        frozenset(name.lower() for name in options.allow_host),
    )


def _certificate(options: ServeOptions) -> Certificate | None:
    if options.tls_cert is None and options.tls_key is None:
        return None
    if options.tls_cert is None or options.tls_key is None:
        raise ValueError("--tls-cert and --tls-key go together: state both")
    return certificate.load(options.tls_cert, options.tls_key)


def service_info(options: ServeOptions, parts: ServiceParts) -> ServiceInfo:
    """Return what `welcome` reports of these parts, once they have started."""
    loaded = parts.recogniser.loaded
    vlm = None if parts.vlm is None else parts.vlm.settings.model
    return ServiceInfo(
        devices(parts),
        Models(encoder=loaded.encoder, gallery=loaded.gallery, vlm=vlm),
        parts.table,
        asks_elsewhere=options.vlm_url is not None,
        crops_elsewhere=options.recogniser_url is not None,
        recorder=parts.recorder,
        saved_materials=parts.saved_materials,
        contact_resistance=options.contact_resistance,
        plate_resistance=options.plate_resistance,
        feel=options.feel,
    )


def devices(parts: ServiceParts) -> Devices:
    """Return the outputs and which of them are simulated."""
    return Devices(
        speaker=Device(name=parts.speaker.name, simulated=parts.speaker.simulated),
        peltier=Device(name=parts.plate.name, simulated=parts.plate.simulated),
    )
