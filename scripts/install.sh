#!/usr/bin/env bash
# Installs a built `nudge` so that it needs neither the checkout nor cargo's target folder, and takes it away again.
#
#   install.sh BINARY [PREFIX]        PREFIX is ~/.local unless told
#   install.sh --uninstall [PREFIX]   removes what the manifest lists, and nothing else
#
#   PREFIX/bin/nudge                  the program that starts it
#   PREFIX/libexec/nudge-program      the program
#   PREFIX/lib/nudge                  the shared libraries that it needs and the system lacks (libtorch)
#   PREFIX/share/nudge                weights, scenes, assets, this script, manifest.txt
#   PREFIX/share/…                    man pages, completions, and for the window its desktop entry, icon and file types
#
# DESTDIR is put before PREFIX, to make a package. Everything is laid out in a folder beside its place first and then
# renamed into it, so that a full disk leaves what was there. Files of an older installation that are no longer part of
# the program are removed; a file that is there and of no installation is not touched, and nothing is installed then.
set -euo pipefail
umask 022
export LC_ALL=C
unset LD_LIBRARY_PATH

fail() { echo "install: $*" >&2; exit 2; }

# Folders that only this program has, below the prefix.
own_folders='lib/nudge share/nudge'
manifest=share/nudge/manifest.txt

# Sets prefix (as the installed program will see it) and root (where it is written to now).
set_prefix() { # PREFIX
    prefix=${1:-'~/.local'}
    case $prefix in
    '~' | '~/'*)
        [ -n "${HOME:-}" ] || fail "there is no HOME; name a PREFIX"
        prefix=$HOME${prefix#'~'} ;;
    esac
    case $prefix in *$'\n'*) fail "a PREFIX of several lines: $prefix" ;; esac
    prefix=$(realpath -ms -- "$prefix")
    root=${DESTDIR:+$(realpath -ms -- "$DESTDIR")}
    root=${root%/}${prefix%/}
    [ -n "$root" ] || fail "PREFIX is /; choose one like /usr/local"
}

made=()
# Makes a folder and those above it, and keeps in mind which ones were not there.
make_folder() { # path
    [ -d "$1" ] && return
    make_folder "$(dirname -- "$1")"
    local why
    why=$(mkdir -- "$1" 2>&1) || fail "cannot make the folder $1 (${why##*: }); choose another PREFIX"
    made+=("$1")
}

# Takes back what an installation that fails has begun.
stage=
clean_up() {
    [ -z "$stage" ] || rm -rf -- "$stage"
    local at
    for ((at = ${#made[@]} - 1; at >= 0; at--)); do rmdir --ignore-fail-on-non-empty -- "${made[at]}" 2>/dev/null || true; done
}

# What `nudge` starts: it lies beside it.
program_of() { # binary
    echo "$(dirname -- "$1")/nudge-program"
}

# The shared libraries of a program that are not the system's own: `name path`.
libraries() { # program
    local listed
    listed=$(ldd -- "$1" 2>&1) || fail "$1 is no program of this machine: $listed"
    case $listed in *'not found'*) fail "$1 lacks $(sed -n 's/^\t\(.*\) => not found$/\1/p' <<<"$listed" | paste -sd ' ')" ;; esac
    sed -n 's/^\t\([^ ]*\) => \(\/.*\) (0x[0-9a-f]*)$/\1 \2/p' <<<"$listed" | grep -vE '^[^ ]+ /(usr/)?lib(32|64|x32)?/' || true
}

# What of these goes along: all of a CUDA libtorch, parts of which are loaded by name only when they are wanted.
with_cuda() { # libraries
    printf '%s\n' "$1"
    local cuda path
    cuda=$(sed -n 's/^libtorch_cuda\.so \(.*\)\/[^/]*$/\1/p' <<<"$1")
    [ -n "$cuda" ] || return 0
    for path in "$cuda"/*.so*; do
        case $'\n'$1 in *$'\n'"${path##*/} "*) ;; *) printf '%s %s\n' "${path##*/}" "$path" ;; esac
    done
}

megabytes() { # libraries
    local name path
    while read -r name path; do
        if [ -n "$path" ]; then stat -Lc %s -- "$path"; fi
    done <<<"$1" | awk '{ bytes += $1 } END { print int(bytes / 1048576) }'
}

# Copies a file into the staging folder.
put() { # mode, file, place below the stage
    local why
    mkdir -p -- "$(dirname -- "$stage/$3")" 2>/dev/null || no_room ''
    why=$(cp --reflink=auto -- "$2" "$stage/$3" 2>&1) || no_room "$why"
    chmod "$1" -- "$stage/$3"
}

put_folder() { # folder, place below the stage
    local file
    while IFS= read -r -d '' file; do put 644 "$1/$file" "$2/$file"; done \
        < <(cd -- "$1" && find . -type f -not -path './mine/*' -not -name '.*' -printf '%P\0')
}

no_room() { # what cp said
    local free
    rm -rf -- "$stage"
    free=$(df -Pm -- "$root" | awk 'NR == 2 { print $4 }')
    case $1 in
    '' | *'No space left'* | *'quota exceeded'*)
        fail "no room in $root: $need_mb MB are needed and $free MB are free; nothing was installed" ;;
    *) fail "cannot write to $root: ${1##*: }; nothing was installed" ;;
    esac
}

# Fills the staging folder with all that is installed.
lay_out() { # binary
    local name path found
    local -a alone=(env -u NUDGE_MODELS -u NUDGE_SCENES)
    put 755 "$1" bin/nudge
    put 755 "$(program_of "$1")" libexec/nudge-program
    while read -r name path; do
        if [ -n "$path" ]; then put 755 "$path" "lib/nudge/$name"; fi
    done <<<"$needed"
    path=$(sed -n 's/^libtorch_cpu\.so \(.*\)\/lib\/[^/]*$/\1/p' <<<"$needed")
    found=
    if [ -n "$path" ]; then found=$("$source/scripts/libtorch.sh" --version-of "$path"); fi
    if [ -n "$found" ]; then printf '%s\n' "$found" >"$stage/lib/nudge/build-version" || no_room ''; fi
    put_folder "$source/models" share/nudge/models
    put_folder "$source/scenes" share/nudge/scenes
    put_folder "$source/assets" share/nudge/assets
    put 755 "$source/scripts/install.sh" share/nudge/install.sh
    for path in "$source"/LICENSE-*; do put 644 "$path" "share/nudge/${path##*/}"; done

    # The program as it will lie there, told nothing of where its things are.
    found=$(libraries "$stage/libexec/nudge-program")
    while read -r name path; do
        case $(realpath -m -- "$path") in
        "$(realpath -m -- "$stage")/lib/nudge/"*) ;;
        *) [ -z "$path" ] || fail "$1 would find $name in $path; build it with make workbench-build" ;;
        esac
    done <<<"$found"
    found=$("${alone[@]}" "$stage/bin/nudge" --version 2>&1) || fail "the program does not run: $found"
    found=$("${alone[@]}" "$stage/bin/nudge" manual "$stage/share" 2>&1) || no_room "$found"
    # What it finds wrong (exit code 1), a disk or a display, may be so on this machine alone.
    found=$("${alone[@]}" "$stage/bin/nudge" doctor --json 2>&1) || [ $? = 1 ] || fail "the program does not run: $found"
    case $found in *'"window": true'*) lay_out_desktop ;; esac
}

# What desktops know the window by.
lay_out_desktop() {
    local assets=$source/assets exec name place text
    put 644 "$assets/icons/nudge.svg" share/icons/hicolor/scalable/apps/nudge.svg
    put 644 "$assets/desktop/nudge-mime.xml" share/mime/packages/nudge.xml
    # Quoted as the Desktop Entry Specification asks for: for the command line, then as a string, with % doubled.
    exec=\"$(printf '%s' "$prefix/bin/nudge" | sed -e 's/[\\"`$]/\\&/g' -e 's/\\/\\\\/g' -e 's/%/%%/g')\"
    while read -r name place; do
        text=$(<"$assets/desktop/$name")
        text=${text//@EXEC@/"$exec"}
        mkdir -p -- "$(dirname -- "$stage/$place")"
        printf '%s\n' "${text//@PROGRAM@/"$prefix/bin/nudge"}" >"$stage/$place" || no_room ''
    done <<'PLACES'
nudge.desktop share/applications/nudge.desktop
nudge-episode.kde.desktop share/kio/servicemenus/nudge-episode.desktop
nudge-episode.action.desktop share/file-manager/actions/nudge-episode.desktop
PLACES
    # KDE asks that menus of a user's own may be executed.
    chmod 755 -- "$stage/share/kio/servicemenus/nudge-episode.desktop"
}

# The files and the folders that an installation lists, in the arrays old_files and old_folders; nothing if there is none.
read_manifest() {
    old_files=() old_folders=()
    [ -e "$root/$manifest" ] || return 0
    local kind path
    while read -r kind path; do
        case /$path/ in *//* | */../*) fail "$root/$manifest: $path does not lie below the prefix" ;; esac
        case $kind in
        file) old_files+=("$path") ;;
        folder) old_folders+=("$path") ;;
        '#' | '') ;;
        *) fail "$root/$manifest is no list of an installation: $kind $path" ;;
        esac
    done <"$root/$manifest"
}

write_manifest() { # files…, --, folders…
    local to=$root/$manifest kind=file path
    {
        echo '# What scripts/install.sh has put below this prefix, and the folders that it has made.'
        for path in "$@"; do
            if [ "$path" = -- ]; then kind=folder; else echo "$kind $path"; fi
        done
    } >"$stage/.manifest" || no_room ''
    mv -f -- "$stage/.manifest" "$to"
}

# Removes folders that nothing is in any more: those of the files, as far as only this program has them, and those that
# were made for it; the deepest first.
prune() { # files…, --, folders…
    local path own folder kind=file
    local -A candidates=()
    for path in "$@"; do
        if [ "$path" = -- ]; then kind=folder; continue; fi
        if [ $kind = folder ]; then candidates[$path]=1; continue; fi
        for own in $own_folders; do
            folder=$(dirname -- "$path")
            while [ "$folder" = "$own" ] || [ "${folder#"$own"/}" != "$folder" ]; do
                candidates[$folder]=1
                folder=$(dirname -- "$folder")
            done
        done
    done
    [ ${#candidates[@]} -gt 0 ] || return 0
    # Deeper folders have more slashes; the prefix itself, written as a dot, comes last.
    printf '%s\n' "${!candidates[@]}" | awk '{ print ($0 == "." ? -1 : gsub("/", "/")) " " $0 }' | sort -rn | cut -d ' ' -f 2- |
        while IFS= read -r path; do
            [ "$path" != . ] || path=
            [ ! -d "$root/$path" ] || rmdir --ignore-fail-on-non-empty -- "$root${path:+/$path}"
        done
}

# Desktops keep an index of entries and file types. Not for a package, whose own scripts do that.
refresh_desktop() {
    [ -z "${DESTDIR:-}" ] || return 0
    if [ -d "$root/share/applications" ] && command -v update-desktop-database >/dev/null; then
        update-desktop-database -q "$root/share/applications" || true
    fi
    if [ -d "$root/share/mime/packages" ] && command -v update-mime-database >/dev/null; then
        update-mime-database "$root/share/mime" >/dev/null 2>&1 || true
    fi
    if [ -e "$root/share/icons/hicolor/icon-theme.cache" ] && command -v gtk-update-icon-cache >/dev/null; then
        gtk-update-icon-cache -qtf "$root/share/icons/hicolor" || true
    fi
}

is_empty_of() { # pattern, folder
    [ ! -d "$2" ] || [ -z "$(find "$2" -maxdepth 1 -name "$1" -print -quit)" ]
}

# The indices that were made for this program alone: nothing else is in their folders, which were made for it.
remove_indices() {
    local folder name
    for folder in "${old_folders[@]}"; do
        case $folder in
        share/applications)
            if is_empty_of '*.desktop' "$root/$folder"; then rm -f -- "$root/$folder/mimeinfo.cache"; fi ;;
        share/mime)
            is_empty_of '*.xml' "$root/$folder/packages" || continue
            for name in aliases generic-icons globs globs2 icons magic mime.cache subclasses treemagic types version XMLnamespaces; do
                rm -f -- "$root/$folder/$name"
            done
            rm -f -- "$root/$folder"/application/x-nudge-*.xml "$root/$folder/application/x-rerun-recording.xml"
            rmdir --ignore-fail-on-non-empty -- "$root/$folder/application" "$root/$folder/packages" 2>/dev/null || true ;;
        esac
    done
}

# Whether files may be added to and removed from the folders of these files.
check_writable() { # files…
    local folder
    while IFS= read -r folder; do
        [ ! -d "$root/$folder" ] || { [ -w "$root/$folder" ] && [ -x "$root/$folder" ]; } ||
            fail "$root/$folder cannot be written to; run this as a user who may, or choose another PREFIX"
    done < <(printf '%s\0' "$@" | xargs -0 dirname -- | sort -u)
}

install_program() { # BINARY, PREFIX
    local binary=$1 file
    source=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
    [ -e "$source/Cargo.toml" ] || fail "an installed copy of this script only uninstalls; run scripts/install.sh of a checkout"
    [ -f "$binary" ] && [ -x "$binary" ] || fail "$binary: no such program; build it first (make workbench-build)"
    file=$(program_of "$binary")
    [ -f "$file" ] && [ -x "$file" ] || fail "$file: no such program; build it first (make workbench-build)"
    set_prefix "${2:-}"
    read_manifest
    needed=$(libraries "$file")
    needed=$(with_cuda "$needed")
    need_mb=$(($(megabytes "$needed") + $(du -Lcm -- "$binary" "$file" "$source/models" "$source/scenes" "$source/assets" | tail -n 1 | cut -f 1)))

    trap clean_up EXIT
    trap 'exit 130' INT TERM
    make_folder "$root"
    [ -w "$root" ] && [ -x "$root" ] || fail "$root cannot be written to; run this as a user who may, or choose another PREFIX"
    # What an installation that was killed has left.
    rm -rf -- "$root"/.nudge-install.*
    stage=$(mktemp -d -- "$root/.nudge-install.XXXXXX") || no_room ''
    lay_out "$binary"

    local -a files=() folders=("${old_folders[@]}") gone=()
    local -A is_new=() is_old=()
    while IFS= read -r -d '' file; do files+=("$file") is_new[$file]=1; done < <(cd -- "$stage" && find . -type f -printf '%P\0' | sort -z)
    for file in "${old_files[@]}"; do
        is_old[$file]=1
        [ -n "${is_new[$file]:-}" ] || [ "$file" = "$manifest" ] || gone+=("$file")
    done
    for file in "${files[@]}"; do
        if [ -d "$root/$file" ]; then fail "$root/$file is a folder; move it away"; fi
        if [ -e "$root/$file" ] && [ -z "${is_old[$file]:-}" ]; then
            fail "$root/$file is there already and of no installation; move it away, or choose another PREFIX"
        fi
    done
    check_writable "${files[@]}" "${gone[@]}"
    for file in "${files[@]}"; do make_folder "$(dirname -- "$root/$file")"; done
    check_writable "${files[@]}"
    for file in "${made[@]}"; do
        case $file in "$root") folders+=(.) ;; "$root"/*) folders+=("${file#"$root"/}") ;; esac
    done

    # From here on everything that can be refused has been. The list comes first and names old and new files, so that
    # whatever stops this, uninstalling or installing again leaves nothing behind; the program comes last.
    write_manifest "${files[@]}" "${gone[@]}" "$manifest" -- "${folders[@]}"
    made=()
    for file in "${files[@]}"; do
        [ "$file" = bin/nudge ] || mv -fT -- "$stage/$file" "$root/$file"
    done
    mv -fT -- "$stage/bin/nudge" "$root/bin/nudge"
    for file in "${gone[@]}"; do rm -f -- "$root/$file"; done
    write_manifest "${files[@]}" "$manifest" -- "${folders[@]}"
    prune "${gone[@]}"
    refresh_desktop
    echo "installed $("$root/bin/nudge" --version) to $prefix: ${#files[@]} files, $need_mb MB"
    case :$PATH: in *:"$prefix/bin":*) ;; *) [ -n "${DESTDIR:-}" ] || echo "$prefix/bin is not in PATH; add it to call nudge by its name" ;; esac
    echo "nudge doctor tells whether all is well; bash '$prefix/share/nudge/install.sh' --uninstall '$prefix' takes it away"
}

uninstall_program() { # PREFIX
    local file
    set_prefix "${1:-}"
    [ -e "$root/$manifest" ] || fail "there is no installation in $prefix ($root/$manifest is not there)"
    read_manifest
    check_writable "${old_files[@]}"
    # The list goes last, so that what was stopped can be gone on with.
    for file in "${old_files[@]}"; do [ "$file" = "$manifest" ] || rm -f -- "$root/$file"; done
    refresh_desktop
    remove_indices
    rm -f -- "$root/$manifest"
    prune "${old_files[@]}" -- "${old_folders[@]}"
    echo "removed nudge from $prefix"
}

# All of it is read before anything is done: uninstalling removes this file.
case ${1:-} in
--uninstall) uninstall_program "${2:-}"; exit ;;
'' | -*) fail "usage: install.sh BINARY [PREFIX], install.sh --uninstall [PREFIX]" ;;
*) install_program "$1" "${2:-}"; exit ;;
esac
