#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/cli/test_describe.sh -- the manual page and the completion scripts, by man, groff and the shells that are here. Usage: test_describe.sh PROGRAM
set -u
program=$1
. "$(dirname "$0")/report.sh"
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1

for form in man bash zsh fish; do
    "$program" describe $form >$form 2>err && [ ! -s err ] && [ "$(tr -dc '\0' <$form | wc -c)" = 0 ]
    report $? "describe $form" "$(cat err)"
done

# ---- the manual page: every option of every command is there, and roff has nothing to say
commands=$("$program" --help | sed -n 's/^  \([a-z-]*\) .*/\1/p')
[ "$(echo "$commands" | wc -l)" -ge 15 ]
report $? "commands are listed" "$commands"
for command in $commands; do
    "$program" $command --help-all | grep -v -e '--progress' -e '--quiet' -e '--config' -e '--help' -e '--help-all' | grep -o -e '--[a-z][a-z-]*' | sort -u
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
    complete_bash "values of an option that takes a file too" 'orbit|' gbtrace render run --path or
    complete_bash "and its files" 'photo.png|' gbtrace render run --path ph
    complete_bash "the first of a list" 'depth|' gbtrace render run --outputs dep
    complete_bash "the next of a list" 'hits,normal|' gbtrace render run --outputs hits,no
    complete_bash "a list behind =" 'hits,normal|' gbtrace render run --outputs = hits,no
    complete_bash "a list by its other name" 'depth|' gbtrace render run --aov dep
    complete_bash "a scene for demo" 'tabletop|terrain|' gbtrace demo --scene t
    complete_bash "how to split" 'auto|' gbtrace train data --eval-split a
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
if command -v zsh >/dev/null && command -v script >/dev/null; then
    rm -f typed
    cat >.zshrc <<'END'
autoload -Uz compinit; compinit -u -d ./dump; . ./zsh
gbtrace() { echo "typed: $*" >>typed }
zle-line-init() { echo ready >>ready }
zle -N zle-line-init
END
    keys() { # each line when zsh's editor waits for it: what comes earlier is not completed
        lines=1
        for line in 'gbtrace tra\t dat\t --init vo\t\n' 'gbtrace render run --path or\t\n' 'gbtrace render run --path ph\t\n' \
            'gbtrace render run --outputs dep\t,nor\t\n' 'gbtrace make-scene tab\t\n' 'exit\n'; do
            while [ "$(cat ready 2>/dev/null | wc -l)" -lt $lines ] && [ ! -e ended ]; do sleep 0.1; done
            printf "$line"
            lines=$((lines + 1))
        done
    }
    keys | { ZDOTDIR=$work script -q -c 'zsh -d -i' /dev/null >out 2>&1; : >ended; }
    [ "$(sed 's,data/,data,; s/ *$//' typed)" = 'typed: train data --init voxel
typed: render run --path orbit
typed: render run --path photo.png
typed: render run --outputs depth,normal
typed: make-scene tabletop' ]
    report $? "zsh: keys on a terminal" "$(cat typed; tail -c 2000 out)"
else
    skip "zsh: keys on a terminal" "zsh or script is not installed"
fi
if command -v fish >/dev/null; then
    HOME=$work fish --no-config -c 'source ./fish; complete -C "gbtrace train --init "' >out 2>&1
    [ "$(cut -f 1 out | sort | tr '\n' ' ')" = "adaptive gb random voxel " ]
    report $? "fish offers choices" "$(cat out)"
    # complete_fish NAME WANTED LINE: what is offered for the last word of the line
    complete_fish() {
        HOME=$work fish --no-config -c "source ./fish; complete -C '$3'" >out 2>&1
        [ "$(cut -f 1 out | sort | tr '\n' ' ')" = "$2" ]
        report $? "fish: $1" "$(cat out)"
    }
    complete_fish "values of an option that takes a file too" "orbit " "gbtrace render run --path orb"
    complete_fish "and its files" "photo.png " "gbtrace render run --path pho"
    complete_fish "the next of a list" "hits,normal " "gbtrace render run --outputs hits,no"
    complete_fish "a procedural scene" "tabletop terrain " "gbtrace demo --scene t"
else
    skip "fish offers choices" "fish is not installed"
fi
finish
