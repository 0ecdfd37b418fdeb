#!/bin/sh
# Starts the tracker with the options of the add-on, as its own user.
#
#   /data/options.json ─▶ site, database, names, days, log level ─┐
#   the supervisor's MQTT service ─▶ KEHAI_MQTT ──────────────────┴─▶ kehai-tracker run
#
# Sources: Home Assistant's developer documentation, add-on communication: GET /services/mqtt.
set -eu

data=${KEHAI_DATA:-/data}
# Of a list, an element a line.
option() { jq --raw-output --arg name "$1" '.[$name] | if type == "array" then .[] else . end' "$data/options.json"; }

# The options belong to the supervisor; what the tracker writes lies in a folder of its own.
install -d -m 0750 -o kehai -g kehai "$data/kehai"
site=$data/kehai/$(option site)

commands=
if [ "$(option mqtt)" = true ]; then
    # In the environment, as everybody on the machine can read the arguments of programs.
    if answer=$(curl --fail --silent --show-error --max-time 10 \
        --header "Authorization: Bearer ${SUPERVISOR_TOKEN:-}" http://supervisor/services/mqtt); then
        KEHAI_MQTT=$(printf '%s' "$answer" | jq --raw-output '.data
            | (if .ssl then "mqtts" else "mqtt" end) as $scheme
            | (if (.username // "") == "" then "" else "\(.username):\(.password)@" end) as $login
            | "\($scheme)://\($login)\(.host):\(.port)"')
        export KEHAI_MQTT
        [ "$(option mqtt_commands)" != true ] || commands=--mqtt-commands
    else
        echo "kehai: the supervisor knows no MQTT broker: nothing is told to Home Assistant. Install the add-on Mosquitto broker, then start this one again" >&2
    fi
fi

set -- run --site "$site" --db "${site%.toml}.db" --first-admin --http 0.0.0.0:8420
# The container's own name is the supervisor's choice, and no browser asks for it.
for name in $(option http_names); do set -- "$@" --http-name "$name"; done
set -- "$@" --keep-days "$(option keep_days)" --log "$(option log_level)" $commands
exec setpriv --reuid kehai --regid kehai --init-groups kehai-tracker "$@"
