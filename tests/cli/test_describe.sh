#!/bin/sh
# tests/cli/test_describe.sh -- the manual page and the completion scripts, by man, groff and the shells that are here. Usage: test_describe.sh PROGRAM
set -u
program=$1
. "$(dirname "$0")/report.sh"
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1

for form in man bash zsh fish; do
    "$program" describe $form >$form 2>err && [ ! -s err ]
    report $? "describe $form" "$(cat err)"
done

# ---- the manual page: every option of every command is there, and roff has nothing to say
commands=$("$program" --help | sed -n 's/^  \([a-z-]*\) .*/\1/p')
[ "$(echo "$commands" | wc -l)" -ge 15 ]
report $? "commands are listed" "$commands"
for command in $commands; do
    "$program" help $command | grep -v -e '--progress' -e '--quiet' -e '--config' -e '--help' | grep -o -e '--[a-z][a-z-]*' | sort -u
done | sort -u | sed 's/-/\\-/g' >wanted
grep -o -F -f wanted man | sort -u | grep -F -x -v -f - wanted >missing
[ -s wanted ] && [ ! -s missing ]
report $? "the manual page has every option" "$(cat missing)"
[ "$(grep -c '^\.SS gbtrace ' man)" = "$(echo "$commands" | wc -l)" ]
report $? "the manual page has every command" "$(grep '^\.SS' man)"
if command -v groff >/dev/null; then
    groff -ww -man -Tutf8 -z man >out 2>&1 && [ ! -s out ]
    report $? "groff has no warning" "$(head -20 out)"
else
    skip "groff has no warning" "groff is not installed"
fi
if command -v man >/dev/null && man --warnings -l man >out 2>err && [ -s out ]; then # a minimal system has a man that only says so
    [ ! -s err ] && sed 's/.\x08//g' out | grep -q 'GBTRACE_THREADS=4'
    report $? "man has no warning" "$(cat err)"
else
    skip "man has no warning" "man is not installed"
fi

# ---- bash: what the script offers
mkdir data 'a folder' && : >photo.png
# complete_bash NAME WANTED WORDS...: the last word is being typed.
complete_bash() {
    name=$1
    wanted=$2
    shift 2
    got=$(bash -c '. ./bash; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _gbtrace; printf "%s|" "${COMPREPLY[@]}"' bash "$@" 2>&1)
    [ "$got" = "$wanted" ]
    report $? "bash: $name" "  wanted $wanted
  got    $got"
}
if command -v bash >/dev/null; then
    complete_bash "a command" 'train|' gbtrace tr
    complete_bash "commands that start alike" 'compare|compress|' gbtrace com
    complete_bash "an option" '--max-depth|--max-anchors|' gbtrace train data --max
    complete_bash "choices" 'gb|adaptive|voxel|random|' gbtrace train data --init ''
    complete_bash "a choice behind =" 'voxel|' gbtrace train data --init = vo
    complete_bash "common options" 'json|' gbtrace info --progress j
    complete_bash "the study" 'speed|stability|' gbtrace study s
    complete_bash "a procedural scene" 'tabletop|' gbtrace make-scene tab
    complete_bash "help" 'doctor|' gbtrace help do
    complete_bash "a path" 'photo.png|' gbtrace info ph
    complete_bash "a folder, with a blank" 'a folder|' gbtrace render run -o a
    complete_bash "only folders" '|' gbtrace render run -o ph
    complete_bash "an alias takes the same" 'a folder|' gbtrace demo --output a
    complete_bash "the value of an alias" 'photo.png|' gbtrace train -m ph
    complete_bash "a number is not guessed" '|' gbtrace train data --seed ''
    complete_bash "what only tells what to use is not offered" '|' gbtrace train data --white
else
    skip "bash" "bash is not installed"
fi
# As a user meets it: keys into an interactive shell on a terminal.
if command -v bash >/dev/null && command -v script >/dev/null; then
    printf 'PS1=; . ./bash; gbtrace() { echo "typed: $*" >typed; }\ngbtrace tra\t dat\t --ini\t=vo\t\nexit\n' >keys
    (cat keys; sleep 0.2) | INPUTRC=/dev/null script -q -c 'bash --norc --noprofile -i' /dev/null >out 2>&1
    [ "$(cat typed 2>&1)" = 'typed: train data/ --init=voxel' ] || [ "$(cat typed 2>&1)" = 'typed: train data/ --init =voxel' ]
    report $? "bash: keys on a terminal" "$(cat typed out)"
else
    skip "bash: keys on a terminal" "script is not installed"
fi

# ---- other shells
if command -v zsh >/dev/null; then
    zsh -n zsh >out 2>&1 && zsh -fc 'autoload -Uz compinit && compinit -u -d dump; . ./zsh; [ "$_comps[gbtrace]" = _gbtrace ]' >>out 2>&1
    report $? "zsh reads its script" "$(cat out)"
else
    skip "zsh reads its script" "zsh is not installed"
fi
if command -v fish >/dev/null; then
    HOME=$work fish --no-config -c 'source ./fish; complete -C "gbtrace train --init "' >out 2>&1
    [ "$(cut -f 1 out | sort | tr '\n' ' ')" = "adaptive gb random voxel " ]
    report $? "fish offers choices" "$(cat out)"
else
    skip "fish offers choices" "fish is not installed"
fi
finish
