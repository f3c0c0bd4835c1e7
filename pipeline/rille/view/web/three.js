// The 3-D library, put on globalThis by the script element before ours.
export const { THREE, OrbitControls, GLTFLoader } = globalThis.RILLE_THREE;
THREE.Object3D.DEFAULT_UP.set(0, 0, 1); // W's own axes: x east, y north, z up
