// What the JavaScript clients say about our files: occt-import-js (STEP), dxf-parser (DXF),
// three.js (STL, GLB) and the Khronos glTF validator (GLB).
// usage: node node_clients.cjs FOLDER_WITH_NODE_MODULES ANSWER.json FILE...
const fs = require('fs');
const path = require('path');
const { pathToFileURL } = require('url');

const [packages, answer, ...files] = process.argv.slice(2);
const home = require('module').createRequire(path.join(path.resolve(packages), 'index.js'));
const three = (file) => import(pathToFileURL(path.resolve(packages, 'node_modules/three', file)));
const bytes = (file) => new Uint8Array(fs.readFileSync(file));
globalThis.self = globalThis; // three.js expects a browser's global

async function step(file) {
  const reader = await home('occt-import-js')();
  const read = reader.ReadStepFile(bytes(file), { linearUnit: 'millimeter' });
  const names = [];
  (function walk(node) {
    names.push(node.name);
    node.children.forEach(walk);
  })(read.root);
  return {
    success: read.success,
    names: [...names, ...read.meshes.map((mesh) => mesh.name)],
    triangles: read.meshes.reduce((sum, mesh) => sum + mesh.index.array.length / 3, 0),
    faces: read.meshes.reduce((sum, mesh) => sum + mesh.brep_faces.length, 0),
    colours: read.meshes.map((mesh) => mesh.color),
  };
}

function dxf(file) {
  const module = home('dxf-parser');
  const drawing = new (module.default || module)().parseSync(fs.readFileSync(file, 'utf8'));
  const header = drawing.header || {}; // the minimal form of sewn-product files has an empty one
  const blocks = Object.values(drawing.blocks || {}).flatMap((block) => block.entities || []);
  return {
    version: header.$ACADVER,
    units: header.$INSUNITS,
    entities: [...drawing.entities, ...blocks].map((entity) => ({
      type: entity.type,
      layer: entity.layer,
      closed: entity.shape === true,
      vertices: (entity.vertices || []).length,
    })),
  };
}

async function stl(file) {
  const { STLLoader } = await three('examples/jsm/loaders/STLLoader.js');
  const geometry = new STLLoader().parse(bytes(file).buffer);
  geometry.computeBoundingBox();
  const { min, max } = geometry.boundingBox;
  return { triangles: geometry.attributes.position.count / 3, min: min.toArray(), max: max.toArray() };
}

// Where the points of the meshes are at times of an animation that no key may have.
function poses(THREE, scene, clip) {
  const mixer = new THREE.AnimationMixer(scene);
  mixer.clipAction(clip).play();
  const point = new THREE.Vector3();
  return [0, 0.1, 0.7, 1.3, 2, 2.5, 4.1].map((time) => {
    mixer.setTime(time);
    scene.updateMatrixWorld(true);
    const meshes = {};
    scene.traverse((thing) => {
      if (!thing.isMesh) return;
      const points = [];
      for (let i = 0; i < thing.geometry.attributes.position.count; i++) {
        thing.getVertexPosition(i, point);
        points.push(...thing.localToWorld(point).toArray());
      }
      meshes[thing.name] = points;
    });
    return { time, meshes };
  });
}

async function glb(file) {
  const validated = await home('gltf-validator').validateBytes(bytes(file), { uri: path.basename(file) });
  const { numErrors, numWarnings, numHints, messages } = validated.issues;
  const THREE = await three('build/three.module.js');
  const { GLTFLoader } = await three('examples/jsm/loaders/GLTFLoader.js');
  const { scene, animations } = await new GLTFLoader().parseAsync(bytes(file).buffer, '');
  scene.updateMatrixWorld(true);
  const box = new THREE.Box3().setFromObject(scene);
  const meshes = [];
  scene.traverse((thing) => {
    if (!thing.isMesh) return;
    const { position, normal, uv } = thing.geometry.attributes;
    meshes.push({
      name: thing.name,
      position: Array.from(position.array),
      normal: Array.from(normal.array),
      uv: Array.from(uv.array),
      index: Array.from(thing.geometry.index.array),
      doubleSided: thing.material.side === THREE.DoubleSide,
      extras: { ...scene.userData, ...thing.userData, ...thing.geometry.userData },
    });
  });
  return {
    poses: animations.length ? poses(THREE, scene, animations[0]) : [],
    issues: { errors: numErrors, warnings: numWarnings, hints: numHints },
    messages,
    min: box.min.toArray(),
    max: box.max.toArray(),
    meshes,
  };
}

const readers = { '.step': step, '.dxf': dxf, '.stl': stl, '.glb': glb };

(async () => {
  const facts = {};
  for (const file of files) {
    try {
      facts[file] = await readers[path.extname(file).toLowerCase()](file);
    } catch (problem) {
      facts[file] = { error: String(problem.stack || problem) };
    }
  }
  fs.writeFileSync(answer, JSON.stringify(facts));
})();
