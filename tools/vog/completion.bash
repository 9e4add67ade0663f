# Completes vog on bash's command line: subcommands and options as --help tells them, settings after
# --set as vog config does, file names elsewhere.
_vog() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}
  local program=${COMP_WORDS[0]} help word subcommands
  if [[ $previous == --set || ( $previous == "=" && ${COMP_WORDS[COMP_CWORD - 2]} == --set ) ]]; then
    compopt -o nospace
    local settings
    settings=$("$program" config 2>/dev/null | awk '
      /^\[/ { table = substr($1, 2, length($1) - 2) }
      /^[a-z]/ { print table "." $1 "=" }')
    mapfile -t COMPREPLY < <(compgen -W "$settings" -- "$current")
    return
  fi
  local command=("$program")
  help=$("$program" --help 2>/dev/null)
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    subcommands=$(sed -n '/^Subcommands:/,$ s/^  \([a-z][a-z-]*\) .*/\1/p' <<<"$help")
    grep -qx -- "$word" <<<"$subcommands" || continue
    command+=("$word")
    help=$("${command[@]}" --help 2>/dev/null)
  done
  if [[ $current == -* ]]; then
    word=$(sed -n 's/^  \(-[a-z],\)\{0,1\}\(--[a-z-]*\).*/\2/p' <<<"$help")
  else
    word=$(sed -n '/^Subcommands:/,$ s/^  \([a-z][a-z-]*\) .*/\1/p' <<<"$help")
  fi
  mapfile -t COMPREPLY < <(compgen -W "$word" -- "$current")
}
complete -o bashdefault -o default -F _vog vog
