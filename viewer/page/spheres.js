// Bounding spheres: glass whose rim is seen.
import { Color, IcosahedronGeometry, InstancedMesh, Matrix4, ShaderMaterial } from "three";
import { SPHERE } from "./colours.js";

const MOST = 20000;

const material = new ShaderMaterial({
  transparent: true,
  depthWrite: false,
  uniforms: { colour: { value: new Color(SPHERE) }, strength: { value: 1 } },
  vertexShader: `
    varying vec3 outward;
    varying vec3 towards;
    void main() {
      vec4 seen = modelViewMatrix * instanceMatrix * vec4(position, 1.0);
      outward = normalize((modelViewMatrix * instanceMatrix * vec4(normal, 0.0)).xyz);
      towards = normalize(-seen.xyz);
      gl_Position = projectionMatrix * seen;
    }`,
  fragmentShader: `
    uniform vec3 colour;
    uniform float strength;
    varying vec3 outward;
    varying vec3 towards;
    void main() {
      float rim = 1.0 - abs(dot(normalize(outward), normalize(towards)));
      gl_FragColor = vec4(colour, strength * (0.02 + 0.8 * pow(rim, 5.0)));
      #include <colorspace_fragment>
    }`,
});

export class Spheres extends InstancedMesh {
  constructor() {
    super(new IcosahedronGeometry(1, 8), material, MOST);
    this.frustumCulled = false;
    this.count = 0;
    this.renderOrder = 5;
  }

  // Centre and radius of each.
  show(numbers) {
    this.count = Math.min(numbers.length / 4, MOST);
    const matrix = new Matrix4();
    for (let at = 0; at < this.count; at++) {
      const [x, y, z, radius] = numbers.subarray(4 * at, 4 * at + 4);
      this.setMatrixAt(at, matrix.makeScale(radius, radius, radius).setPosition(x, y, z));
    }
    // Many overlap: each is fainter.
    material.uniforms.strength.value = Math.min(1, 2 / Math.sqrt(1 + this.count / 12));
    this.instanceMatrix.needsUpdate = true;
  }
}
