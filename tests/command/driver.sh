#!/bin/sh
# Test: what the program says when the driver of the GPU is too old or fails: PROGRAM FOLDER ROOT DRIVER.
driver=$(dirname "$4")
. "$(dirname "$0")/common.sh"
. "$(dirname "$0")/scenes.sh"

active plain.yaml "run: {steps: 4, seed: 7}"
LD_LIBRARY_PATH=$driver
GBG_DRIVER_VERSION=99000
export LD_LIBRARY_PATH GBG_DRIVER_VERSION GBG_DRIVER_ERROR

# driver ERROR WORDS: the backend cuda is refused with one sentence, and auto goes on with the CPU.
driver() {
    GBG_DRIVER_ERROR=$1
    for name in cuda cuda:0 cuda:7; do
        expect 1 "backend cuda: no GPU $2" run plain.yaml --backend $name
        [ "$(wc -l <said)" -eq 1 ] || fault "more than one line: $(cat said)"
        grep -q "cpu and auto work without it" said || fault "no remedy: $(cat said)"
    done
    expect 0 "auto takes cpu: no GPU $2" run plain.yaml
    expect 0 "auto takes cpu: no GPU $2" info
}

driver 100 "was found (no CUDA-capable device is detected)"
driver 803 "was found (system has unsupported display driver"
driver 999 "was found (unknown error)"
driver 2 "was found (out of memory)"
GBG_DRIVER_VERSION=11040
driver 100 "can be used: the driver is for CUDA 11.4, this build needs one for"
exit $failed
