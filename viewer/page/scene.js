// The picture: the surface, the closest pair, contacts and the force.
import {
  AmbientLight, BufferAttribute, BufferGeometry, ConeGeometry, CylinderGeometry, DirectionalLight, DoubleSide, Group,
  Mesh, MeshBasicMaterial, MeshStandardMaterial, PerspectiveCamera, Points, PointsMaterial, Scene, SphereGeometry, Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { COMMANDED, FORCE, ofSeparation, UNKNOWN } from "./colours.js";
import { Spheres } from "./spheres.js";
import { Tool } from "./tool.js";

const UP = new Vector3(0, 1, 0);
const CONTACTS = 16;

// A rod between two points.
class Rod extends Mesh {
  constructor(material, radius) {
    super(new CylinderGeometry(1, 1, 1, 12), material);
    this.radius = radius;
  }

  between(from, to) {
    const way = to.clone().sub(from);
    const length = way.length();
    this.visible = length > 0;
    this.position.copy(from).addScaledVector(way, 0.5);
    this.scale.set(this.radius, Math.max(length, 1e-6), this.radius);
    this.quaternion.setFromUnitVectors(UP, way.normalize());
  }
}

class Arrow extends Group {
  constructor(material, radius) {
    super();
    this.rod = new Rod(material, radius);
    this.head = new Mesh(new ConeGeometry(2.6 * radius, 7 * radius, 16), material);
    this.add(this.rod, this.head);
    this.radius = radius;
  }

  // From a point along a unit vector.
  along(from, direction, length) {
    const neck = from.clone().addScaledVector(direction, Math.max(length - 7 * this.radius, 0));
    this.rod.between(from, neck);
    this.head.position.copy(neck).addScaledVector(direction, 3.5 * this.radius);
    this.head.quaternion.setFromUnitVectors(UP, direction);
  }
}

// Drawn over everything: a pair behind the surface is no less wanted.
const overlay = (colour) => new MeshBasicMaterial({ color: colour, depthTest: false, transparent: true });

export class Picture {
  // Throws where there is no WebGL.
  constructor(parent, triangles, positions) {
    this.renderer = new WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    parent.prepend(this.renderer.domElement);
    this.parent = parent;
    this.scene = new Scene();

    this.geometry = new BufferGeometry();
    this.geometry.setIndex(new BufferAttribute(triangles, 1));
    this.geometry.setAttribute("position", new BufferAttribute(positions, 3));
    this.geometry.computeVertexNormals();
    this.geometry.computeBoundingSphere();
    const { center, radius } = this.geometry.boundingSphere;
    this.radius = radius;

    this.material = new MeshStandardMaterial({ color: "#c9857a", roughness: 0.62, side: DoubleSide });
    this.surface = new Mesh(this.geometry, this.material);
    this.surface.frustumCulled = false;
    this.lines = new Mesh(this.geometry, new MeshBasicMaterial({ color: "#3a2320", wireframe: true, transparent: true, opacity: 0.35 }));
    this.lines.frustumCulled = false;
    this.lines.visible = false;

    this.camera = new PerspectiveCamera(35, 1, radius / 100, radius * 40);
    this.camera.up.set(0, 0, 1);
    this.camera.position.copy(center).addScaledVector(new Vector3(0.35, -1, 0.32).normalize(), 3.7 * radius);
    const sun = new DirectionalLight("#fff", 2.2);
    sun.position.set(-0.5, 0.9, 1);
    this.camera.add(sun);
    this.scene.add(this.camera, new AmbientLight("#fff", 1.1), this.surface, this.lines);

    const thin = 0.006 * radius;
    this.pairColour = overlay("#1b2430");
    this.pair = new Rod(this.pairColour, 0.8 * thin);
    this.ends = [0, 1].map(() => new Mesh(new SphereGeometry(2 * thin, 16, 12), this.pairColour));
    this.force = new Arrow(overlay(FORCE), 1.2 * thin);
    this.contacts = Array.from({ length: CONTACTS }, () => new Arrow(overlay("#000"), 0.8 * thin));
    const over = [this.pair, ...this.ends, this.force, ...this.contacts];
    for (const object of over) object.traverse((part) => (part.renderOrder = 10));
    this.spheres = new Spheres();
    this.tool = new Tool(radius);
    this.commanded = new Tool(radius).ghost(COMMANDED);
    // Nodes lie below the surface: they are drawn over it.
    const dot = { size: 0.03 * radius, depthTest: false, transparent: true, opacity: 0.8 };
    this.dots = new Points(new BufferGeometry(), new PointsMaterial(dot));
    this.dots.frustumCulled = false;
    this.dots.renderOrder = 4;
    this.scene.add(...over, this.spheres, this.tool, this.commanded, this.dots);

    this.orbit = new OrbitControls(this.camera, this.renderer.domElement);
    this.orbit.target.copy(center).addScaledVector(new Vector3(0, 0, 1), 0.15 * radius);
    this.orbit.minDistance = 0.3 * radius;
    this.orbit.maxDistance = 20 * radius;
    this.orbit.update();
    this.orbit.saveState();
    new ResizeObserver(() => this.resize()).observe(parent);
    this.resize();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.parent;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    // On a narrow screen the width decides.
    this.camera.fov = width < height ? 2 * Math.atan(Math.tan(0.3054) * (height / width)) * (180 / Math.PI) : 35;
    this.camera.updateProjectionMatrix();
  }

  move(positions) {
    const attribute = this.geometry.attributes.position;
    // A surface that stands still keeps its normals, and what the graphics card has of it.
    if (positions.every((axis, at) => axis === attribute.array[at])) return;
    attribute.array.set(positions);
    attribute.needsUpdate = true;
    this.geometry.computeVertexNormals();
  }

  show(answer, origin, touching) {
    const local = (point) => new Vector3(...point.map((axis, at) => axis - origin[at]));
    const [from, to] = [local(answer.point_on_surface), local(answer.point_on_tool)];
    const hasSide = answer.side !== "undefined";
    const colour = hasSide ? ofSeparation(answer.separation, 0.3 * this.radius) : UNKNOWN;
    this.tool.colour(colour);
    this.pair.between(from, to);
    this.ends.forEach((end, at) => end.position.copy(at ? to : from));
    this.contacts.forEach((arrow, at) => {
      const contact = touching.contacts[at];
      arrow.visible = contact !== undefined;
      if (!contact) return;
      arrow.rod.material.color.copy(ofSeparation(contact.separation, 0.3 * this.radius));
      arrow.along(new Vector3(...contact.on_surface), new Vector3(...contact.normal), 0.14 * this.radius);
    });
    const force = new Vector3(...touching.force);
    const newtons = force.length();
    this.force.visible = newtons > 0;
    if (newtons > 0) this.force.along(to, force.divideScalar(newtons), 0.12 * this.radius * (0.7 + newtons));
  }

  // Shows the commanded pose beside the admitted one; none hides it.
  command(pose) {
    this.commanded.visible = pose !== undefined;
    if (pose) this.commanded.pose(pose);
  }

  nodes(positions) {
    const { geometry } = this.dots;
    this.dots.visible = positions.length > 0;
    if (geometry.attributes.position?.array.length === positions.length) {
      geometry.attributes.position.array.set(positions);
      geometry.attributes.position.needsUpdate = true;
    } else {
      geometry.setAttribute("position", new BufferAttribute(positions, 3));
    }
  }

  // Back to the view at the start.
  reset() {
    this.orbit.reset();
  }

  // The colour of pair and nodes must be seen on a light and on a dark ground.
  dress(ink) {
    for (const material of [this.pairColour, this.dots.material]) material.color.set(ink);
  }

  look({ opacity, wire }) {
    this.material.opacity = opacity;
    this.material.transparent = opacity < 1;
    this.material.depthWrite = opacity === 1;
    this.lines.visible = wire;
  }

  draw() {
    this.orbit.update();
    this.renderer.render(this.scene, this.camera);
  }
}
