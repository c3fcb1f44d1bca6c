#!/bin/sh
# Look at a pixel of the wide view with curl, and save the point cloud: sh fixate.sh 720 540 cloud.ply
set -eu
url=${FOVEACAM_URL:-http://127.0.0.1:8000}
url=${url%/}/api/v1

ask() {
  curl --silent --show-error --fail-with-body ${FOVEACAM_TOKEN:+--header "Authorization: Bearer $FOVEACAM_TOKEN"} "$@"
}
# A value of the JSON document at the standard input
value() {
  python3 -c 'import json, sys; print(json.load(sys.stdin)[sys.argv[1]])' "$1"
}

fixation=$(ask "$url/fixations" --header 'Content-Type: application/json' --header 'Prefer: wait=60' \
  --data "{\"pixel\": {\"x_px\": $1, \"y_px\": $2}}")
echo "$fixation" | value distance_m
echo "$fixation" | value distance_sigma_m

id=$(echo "$fixation" | value id)
cloud=None
for _ in $(seq 30); do # it is computed after the answer
  cloud=$(ask "$url/fixations/$id" | value cloud_id)
  [ "$cloud" = None ] || break
  sleep 1
done
ask "$url/clouds/$cloud.ply" --output "$3"
