/**
 * Evaluated in the page: the emulated right controller touches one object, by poses alone, and stays until
 * it is decided or `patience` (ms) ran out; with `feelsPlate` until the plate is told to cool, too. Resolves
 * to the decision with the plate's telemetry of that moment, or to null.
 */
async ({main, three, session}, {key, patience, feelsPlate}) => {
  const NEUTRAL_C = 32;
  const object = main.objects.find((one) => one.key === key);
  const hand = main.headset.controllers.right;
  const {start, point} = wayTo(object);
  const end = performance.now() + patience;
  await moveTo(start);
  for (let i = 1; i <= 4; i++) await moveTo(start.clone().lerp(point, i / 4));
  let plate = null;
  let swing = 0.002;
  while (!isDone() && performance.now() < end) {
    await moveTo(point.clone().add({x: swing, y: 0, z: 0}));
    swing = -swing;
  }
  const decision = main.decisions.get(object.object_id) ?? null;
  await moveTo(start);
  return decision && {...decision, plate};

  function isDone() {
    const decision = main.decisions.get(object.object_id);
    if (!decision || (decision.material === 'unknown' && !decision.evidence.length)) return false;
    if (!feelsPlate || main.plate.setpoint_c >= NEUTRAL_C - 1) return !feelsPlate;
    plate = main.plate;
    return true;
  }

  /** A free way to the object's surface, from the front or from above: 13 cm out, and just touching. */
  function wayTo({root}) {
    const box = new three.Box3().setFromObject(root);
    for (const [x, side] of [0.5, 0.35, 0.65, 0.2, 0.8].flatMap((x) => [[x, 'z'], [x, 'y']])) {
      const out = new three.Vector3()[side === 'z' ? 'setZ' : 'setY'](1);
      const from = box.min.clone().lerp(box.max, 0.5);
      from.x = box.min.x + x * (box.max.x - box.min.x);
      from[side] = box.max[side] + 0.3;
      const ray = new three.Raycaster(from, out.clone().negate());
      const [hit] = ray.intersectObjects(main.objects.map((one) => one.root), true);
      if (!hit || !root.getObjectById(hit.object.id)) continue;
      const at = (distance) => hit.point.clone().addScaledVector(out, distance);
      return {start: at(0.13), point: at(0.007)};
    }
    throw new Error(`no free way to the ${key}`);
  }

  function moveTo({x, y, z}) {
    hand.position.set(x, y, z);
    return new Promise((moved) => session.requestAnimationFrame(moved));
  }
}
