#!/bin/sh
# Every relative link of the Markdown files leads to a file: links.sh ROOT.
cd "$1" || exit 2
failed=0
for page in *.md docs/*.md; do
    for target in $(sed 's/](/\n](/g' "$page" | sed -n 's/^](\([^)#]*\).*/\1/p' | grep -v '^[a-z]*:'); do
        if [ ! -e "$(dirname "$page")/$target" ]; then
            echo "$page: no such file: $target"
            failed=1
        fi
    done
done
exit $failed
