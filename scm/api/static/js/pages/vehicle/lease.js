/** Who drives a car, in words. */

/** Whether nobody but its own driver has the car. */
export function isAtHome(car) {
  return car.lease_left_ms === null;
}

export function ownerOf(car) {
  if (!isAtHome(car)) return car.owner;
  return car.kind === "hosted" ? "its driver" : "its agent";
}
