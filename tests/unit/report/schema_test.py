# SPDX-License-Identifier: MIT
"""schema_test.py SCHEMAS RESULTS: every result file holds against the JSON Schema of its kind, and each schema tells a
wrong file from a right one."""
import copy
import json
import pathlib
import sys

import jsonschema

schemas, results = (pathlib.Path(argument) for argument in sys.argv[1:3])
validators = {}
for path in sorted(schemas.glob("*.json")):
    schema = json.loads(path.read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    validators[schema["title"]] = jsonschema.Draft202012Validator(schema)

failed = 0
checked = set()
for path in sorted(results.glob("*.json")):
    result = json.loads(path.read_text())
    validator = validators[result["schema"]]
    for error in validator.iter_errors(result):
        failed += 1
        print(f"{path.name}: {error.json_path}: {error.message[:200]}")
    checked.add(result["schema"])
    for key in validator.schema["required"]:
        broken = copy.deepcopy(result)
        del broken[key]
        if validator.is_valid(broken):
            failed += 1
            print(f"{path.name} holds without {key}")
missing = set(validators) - checked
if missing:
    failed += 1
    print(f"no file of {sorted(missing)}")
sys.exit(1 if failed else 0)
