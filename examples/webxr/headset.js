/** An emulated headset (iwer's Quest 3) for `?emulate` and the tests: VR without a headset. */
import {XRDevice, metaQuest3} from 'iwer';

const LOOKS_DOWN = 0.6; // rad, at the table

/** Creates a headset that moves only on request: `device.position`, `device.controllers.right.position`, ... */
export const device = new XRDevice(metaQuest3, {stereoEnabled: true});
device.installRuntime({forceInstall: true});
device.position.set(0, 1.35, 0.5);
device.quaternion.set(Math.sin(-LOOKS_DOWN / 2), 0, 0, Math.cos(LOOKS_DOWN / 2));
device.controllers.left.position.set(-0.3, 1.15, 0.35);
device.controllers.right.position.set(0.3, 1.15, 0.35);
