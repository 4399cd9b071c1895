/** An emulated headset (iwer's Quest 3), for `?emulate`: VR without a headset, and the tests. */
import {XRDevice, metaQuest3} from 'iwer';

/** Moves only when told to: `device.position`, `device.controllers.right.position`, ... */
export const device = new XRDevice(metaQuest3, {stereoEnabled: true});
device.installRuntime({forceInstall: true});
device.position.set(0, 1.45, 0.55);
device.controllers.left.position.set(-0.3, 1.15, 0.35);
device.controllers.right.position.set(0.3, 1.15, 0.35);
