// Validates the glTF files named on the command line with Khronos' validator; any message at all is a failure.
const fs = require('fs');
const validator = require('gltf-validator');

(async () => {
  for (const file of process.argv.slice(2)) {
    const { issues } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
    if (issues.messages.length === 0) continue;
    console.error(file, JSON.stringify(issues.messages, null, 1));
    process.exitCode = 1;
  }
})();
