"""The examples that end every command's help: what each is for, and the line to type.

The tests parse every line with the real commands, and run those that cost little on a virtual clip.
"""

EXAMPLES: dict[str, tuple[tuple[str, str], ...]] = {
    "": (
        ("no camera at hand: see the whole chain on a virtual shoot", "psvideo demo"),
        ("is everything there that a shoot needs?", "psvideo doctor"),
        ("from a clip with its plan.toml to normals and albedo", "psvideo normals clip/ --rig rig.toml -o out/"),
    ),
    "capture-plan": (
        (
            "three lights, a camera of the table, flashes of 0.8 ms",
            'psvideo capture-plan --camera "Sony F65" --fps 120 --lights key,left,right --flash 0.8ms -o plan.toml',
        ),
        (
            "how short a flash does a subject at 0.5 m/s need? (field of view 0.6 m wide, at most 1 pixel of blur)",
            'psvideo capture-plan --camera "Sony F65" --fps 120 --speed 0.5m/s --field-width 0.6m --max-blur 1',
        ),
        (
            "a camera that is not in the table, and the timing as a drawing",
            "psvideo capture-plan --size 1920x1080 --fps 119.88 --readout 8.1ms --flash 0.8ms --diagram timing.svg "
            "-o plan.toml",
        ),
        ("which cameras are in the table?", "psvideo capture-plan --list-cameras"),
    ),
    "strobe": (
        ("can the plan be played, and by which boards?", "psvideo strobe check plan.toml"),
        ("play it on the board for ten seconds", "psvideo strobe run plan.toml --seconds 10 --log clip/strobe.json"),
        ("no board at hand: an emulated one", "psvideo strobe run plan.toml --port emulated --rounds 20"),
    ),
    "strobe list": (
        ("ports at which a board may be", "psvideo strobe list"),
        ("all ports of this machine, for a program", "psvideo strobe list --verbose --json"),
    ),
    "strobe check": (
        ("every board of the table", "psvideo strobe check plan.toml"),
        ("one board, one wiring, one light elsewhere", "psvideo strobe check plan.toml --board rp2040 --line key=3"),
        ("the board that is plugged in", "psvideo strobe check plan.toml --port auto"),
    ),
    "strobe run": (
        ("for a take: until Ctrl-C, with the log for the clip", "psvideo strobe run plan.toml --log clip/strobe.json"),
        ("a test of ten seconds", "psvideo strobe run plan.toml --seconds 10"),
        ("no board at hand: an emulated one, no light", "psvideo strobe run plan.toml --port emulated --rounds 20"),
    ),
    "strobe stop": (
        ("dark, now", "psvideo strobe stop"),
        ("at a port that is not found by itself", "psvideo strobe stop --port /dev/ttyUSB0"),
    ),
    "strobe emulate": (
        ("the real firmware on an emulated chip, its edges in a file", "psvideo strobe emulate --trace edges.csv"),
        ("a board in plain Python, on every system", "psvideo strobe emulate --board python"),
    ),
    "live": (
        ("see on a finished clip what the set will see", "psvideo live clip/ --rig rig.toml"),
        (
            "is live timing as good as sync? every frame looked at, none waited for",
            "psvideo live clip/ --pace fastest --timing-out timing.json",
        ),
        ("a camera's stream on the network", "psvideo live udp://127.0.0.1:5000 --plan plan.toml --rig rig.toml"),
        ("a folder that a recorder is writing", "psvideo live frames/ --growing --plan plan.toml --rig rig.toml"),
    ),
    "check": (
        ("can this take be used, and if not, what is to change on set?", "psvideo check clip/"),
        ("hold the plates against the rig as well", "psvideo check clip/ --rig rig.toml"),
        ("a day's takes, and a page of them", "psvideo check takes/* --report checks.html"),
        (
            "every take that is copied into a folder, with one plan for all, and a page that others may look at",
            "psvideo check --watch takes/ --plan plan.toml --report checks.html",
        ),
    ),
    "calibrate": (
        (
            "where the lights are, from a chrome ball",
            "psvideo calibrate mirror-sphere sphere/ --focal-mm 85 --sensor-mm 36 -o rig.toml",
        ),
        ("how long the camera takes to read a frame", "psvideo calibrate readout clip.mov --led-hz 1000"),
        (
            "how strong the lights are, from white paper",
            "psvideo calibrate flat-field paper/ --rig rig.toml --albedo 0.85 -o rig2.toml",
        ),
    ),
    "calibrate mirror-sphere": (
        (
            "a chrome ball in the middle of the picture, 85 mm lens on full frame",
            "psvideo calibrate mirror-sphere sphere/ --focal-mm 85 --sensor-mm 36 -o rig.toml",
        ),
        (
            "near lights: one ball of 40 mm radius in three places",
            "psvideo calibrate mirror-sphere left/ middle/ right/ --radius-mm 40 --focal-px 2900 -o rig.toml",
        ),
        (
            "the outline is not found: give it by hand",
            "psvideo calibrate mirror-sphere sphere/ --circle 960,540,310 --focal-px 2900 -o rig.toml",
        ),
    ),
    "calibrate matte-sphere": (
        (
            "directions and strengths from a matte ball of known albedo",
            "psvideo calibrate matte-sphere sphere/ --albedo 0.9 --focal-px 2900 -o rig.toml",
        ),
        (
            "a strobed clip of the ball, outline given by hand",
            "psvideo calibrate matte-sphere clip/ --circle 80,59,50 -o rig.toml",
        ),
    ),
    "calibrate flat-field": (
        (
            "strengths from a sheet of white paper that faces the camera",
            "psvideo calibrate flat-field paper/ --rig rig.toml --albedo 0.85 -o rig2.toml",
        ),
        (
            "only a part of the picture is paper",
            "psvideo calibrate flat-field paper/ --rig rig.toml --box 400,200,1500,900 -o rig2.toml",
        ),
    ),
    "calibrate colours": (
        (
            "what red, green and blue see of each LED, from white paper that one LED at a time lights",
            "psvideo calibrate colours paper/ --rig rig.toml --albedo 0.85 -o rig2.toml",
        ),
        (
            "only a part of the picture is paper",
            "psvideo calibrate colours paper/ --rig rig.toml --box 400,200,1500,900 -o rig2.toml",
        ),
    ),
    "calibrate intensities": (
        (
            "relative strengths from the scene itself, from four lights on",
            "psvideo calibrate intensities clip/ --rig rig.toml -o rig2.toml",
        ),
        ("from plates that split wrote", "psvideo calibrate intensities plates/ --rig rig.toml -o rig2.toml"),
    ),
    "calibrate guess": (
        ("nothing was calibrated: a first guess", "psvideo calibrate guess plates/ -o guess.toml"),
        ("many lights of one kind", "psvideo calibrate guess plates/ --prior equal-lights -o guess.toml"),
    ),
    "calibrate convert": (
        ("for RTI programs", "psvideo calibrate convert clip/rig.toml -o lights.lp"),
        (
            "an .lp file of three lights as rig.toml, with names",
            "psvideo calibrate convert lights.lp --name key --name left --name right -o rig3.toml",
        ),
    ),
    "calibrate readout": (
        ("from stripes of an LED that blinks at 1000 Hz", "psvideo calibrate readout clip.mov --led-hz 1000"),
        (
            "a board with a ceramic resonator, and lines for the tables",
            "psvideo calibrate readout stripes/ --led-hz 500 --led-tolerance-ppm 5000 --fps 119.88 --make Sony "
            "--model F65",
        ),
        ("from a strobed clip with its plan.toml, no LED needed", "psvideo calibrate readout clip/"),
    ),
    "info": (
        ("does the footage fit the plan?", "psvideo info clip/"),
        ("a movie whose plan lies elsewhere, with all facts", "psvideo info take7.mov --plan plan.toml --verbose"),
        ("any file that psvideo wrote or reads", "psvideo info clip/rig.toml"),
    ),
    "sync": (
        ("when did every flash fire, and how certain is that?", "psvideo sync clip/"),
        ("kept for later, with a picture to look at", "psvideo sync clip/ -o timing.json --picture timing.png"),
        ("a plan without a marker: say which light flashed first", "psvideo sync clip/ --first-light key"),
        ("several cameras under one strobe: their clocks", "psvideo sync camA/ camB/ camC/ -o clocks.json"),
    ),
    "split": (
        ("one EXR sequence per light", "psvideo split clip/ -o plates/"),
        (
            "only a part, with the timing found before",
            "psvideo split clip/ --frames 1-100 --timing timing.json -o part/",
        ),
        ("and the scene under all lights at once", "psvideo split clip/ --beauty --preview beauty -o plates/"),
        (
            "24 a second, the same instants as the other cameras of this strobe",
            "psvideo split camB/ --fps 24 --resync clocks.json -o platesB/",
        ),
        ("the paper's Algorithm 1, to compare with", "psvideo split clip/ --method hudon2015 -o plates_2015/"),
    ),
    "normals": (
        (
            "normals, albedo and validity for every round of flashes",
            "psvideo normals clip/ --rig clip/rig.toml -o out/",
        ),
        (
            "shiny skin under five lights or more, with an error map",
            "psvideo normals clip/ --rig rig.toml --solver robust --aov error -o out/",
        ),
        (
            "a moving subject: one result per flash; a rate such as 24 too",
            "psvideo normals clip/ --rig rig.toml --fps flash -o out/",
        ),
        (
            "for Unreal: tangent space, green down, 16-bit PNG too, and a note on how to load them",
            "psvideo normals clip/ --rig rig.toml --for unreal -o out/",
        ),
        (
            "in the scene's space, with the camera of a USD file; and a movie of the normals",
            "psvideo normals clip/ --rig rig.toml --space world --camera-to-world shot.usd --preview normals -o out/",
        ),
        (
            "all takes of a day by four processes, with one report over all",
            "psvideo normals takes/* --rig rig.toml --workers 4 -o results/",
        ),
    ),
    "farm": (
        (
            "a job of ten pieces for Deadline Cloud, or for openjd here",
            "psvideo farm clip/ --rig rig.toml --pieces 10 -o job/",
        ),
        (
            "shell commands for any other farm, with options of psvideo normals",
            "psvideo farm clip/ --rig rig.toml --results out/ --commands -- --aov depth --fps 24",
        ),
    ),
    "stills": (
        (
            "twelve photographs and a light list, no plan",
            "psvideo stills photos/ --lights lights.lp -o out/",
        ),
        (
            "a chrome ball at two places under the same lights",
            "psvideo stills photos/ --sphere ball_left/ --sphere ball_right/ -o out/",
        ),
        (
            "8-bit pictures that hold linear light, with a soft matte, and a page to relight them on",
            "psvideo stills photos/ --lights rig.toml --transfer linear --aov alpha -o out/",
        ),
    ),
    "view": (
        ("scrub normals and albedo, and move a light over them", "psvideo view out/"),
        ("a clip: its frames, and plates beside those of Algorithm 1 of Hudon et al. (2015)", "psvideo view clip/"),
        ("one file to send to somebody, 24 pictures of each kind", "psvideo view out/ --export page.html"),
        ("at a port of your choice, opened by yourself", "psvideo view out/ --port 9000 --no-browser"),
    ),
    "doctor": (
        ("is everything here, and how fast is this machine?", "psvideo doctor"),
        ("the disk that the results will go to, for a program", "psvideo doctor --folder /tmp --json"),
    ),
    "demo": (
        ("the whole chain, into ./psvideo-demo", "psvideo demo"),
        ("again, into another folder", "psvideo demo -o try2/ --force"),
    ),
    "synth": (
        ("film a virtual bust; the truth lies beside the clip", "psvideo synth bust -o clip/"),
        (
            "lit by what an emulated board really did",
            "psvideo synth sphere --trace edges.csv --line key=0 -o traced/",
        ),
    ),
}
"""By a command's path without ``psvideo``."""
