// The instrument's body: a sphere or a capsule, with a knob to grab at either end.
import { Color, CylinderGeometry, Group, Mesh, MeshStandardMaterial, SphereGeometry, Vector3 } from "three";

const UP = new Vector3(0, 1, 0);

export class Tool extends Group {
  constructor(radius) {
    super();
    const material = (name) => new MeshStandardMaterial({ color: name, roughness: 0.3, metalness: 0.25 });
    this.body = material("#888");
    const ball = () => new Mesh(new SphereGeometry(1, 32, 20), this.body);
    this.balls = [ball(), ball()];
    this.shaft = new Mesh(new CylinderGeometry(1, 1, 1, 32, 1, true), this.body);
    this.least = 0.035 * radius;
    this.add(...this.balls, this.shaft);
  }

  // A body that is seen through.
  ghost(colour) {
    this.colour(colour);
    Object.assign(this.body, { transparent: true, opacity: 0.45, depthWrite: false });
    this.visible = false;
    return this;
  }

  colour(colour) {
    this.body.color.copy(colour);
    this.body.emissive.copy(new Color(colour)).multiplyScalar(0.12);
  }

  pose(numbers) {
    const radius = numbers.at(-1);
    const isCapsule = numbers.length === 7;
    const start = new Vector3(...numbers.slice(0, 3));
    const end = isCapsule ? new Vector3(...numbers.slice(3, 6)) : start;
    this.balls.forEach((ball, at) => {
      ball.position.copy(at ? end : start);
      ball.scale.setScalar(Math.max(radius, 1e-6));
    });
    const way = end.clone().sub(start);
    const length = way.length();
    this.shaft.visible = length > 0;
    this.shaft.position.copy(start).addScaledVector(way, 0.5);
    this.shaft.scale.set(radius, Math.max(length, 1e-6), radius);
    this.shaft.quaternion.setFromUnitVectors(UP, way.normalize());
  }
}
