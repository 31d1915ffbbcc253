"""English words that the filtering policy goes by: closed classes, not things of one world."""


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


PEOPLE = _words(
    """person persons people human humans man men woman women child children boy boys girl girls
    kid kids adult adults teenager teenagers toddler toddlers baby babies somebody someone anybody
    anyone pedestrian pedestrians passerby bystander bystanders worker workers employee employees
    colleague colleagues coworker coworkers staff personnel crowd crowds visitor visitors customer
    customers shopper shoppers tourist tourists passenger passengers guest guests patient patients
    nurse nurses doctor doctors student students pupil pupils teacher teachers technician
    technicians engineer engineers janitor janitors guy guys lady gentleman gentlemen
    officer officers
    cyclist cyclists family"""
)
"""Whatever stands before them, they are people; unless it is lifeless."""

PERHAPS_PEOPLE = {
    "guard": _words("security prison museum night border"),
    "guards": _words("security prison museum night border"),
    "driver": _words("forklift truck lorry bus car van taxi delivery lift train tram cab"),
    "drivers": _words("forklift truck lorry bus car van taxi delivery lift train tram cab"),
    "operator": _words("machine crane forklift plant phone telephone switchboard"),
    "operators": _words("machine crane forklift plant phone telephone switchboard"),
    "cleaner": _words("window office street"),
    "cleaners": _words("window office street"),
}
"""People alone or after one of these words, and devices after another: "door operator"."""

ANIMALS = _words(
    """animal animals dog dogs puppy puppies cat cats kitten kittens bird birds pigeon pigeons
    seagull seagulls sparrow sparrows squirrel squirrels rat rats pet pets insect insects fly flies
    wasp wasps bee bees cockroach cockroaches moth moths lizard lizards"""
)
PERHAPS_ALIVE = _words(
    "horse horses cow cows sheep goat goats pig pigs duck ducks chicken chickens rabbit rabbits "
    "fox foxes spider spiders snake snakes mouse mice"
)
"""Animals, unless a word before them says otherwise: "clothes horse"."""

LIFELESS = _words(
    "toy toys plush stuffed robot robotic statue stone bronze marble wax inflatable painted carved "
    "plastic cardboard wooden metal dummy"
)
"""What makes a figure of a living being."""

MOVED_BY_HAND = _words(
    """box boxes carton cartons crate crates parcel parcels package packages packet packets bag bags
    sack sacks suitcase suitcases backpack backpacks rucksack rucksacks handbag handbags luggage
    baggage litter rubbish debris clutter"""
)
"""Gone tomorrow, unless a word before them says what they serve: "fuse box", "letter box"."""

DESCRIPTIVE = _words(
    """a an the this that these those some any several many few no another other one two three four
    five six seven eight nine ten dozen single pair my your his her their its
    big small large little tiny huge tall short long wide narrow thin thick heavy light round square
    flat high low medium
    red green blue yellow orange white black grey gray brown beige pink purple dark bright coloured
    colored silver golden
    cardboard wooden wood paper plastic metal steel cloth leather canvas plywood
    loose open opened closed empty full old new used stacked stray scattered abandoned unattended
    forgotten discarded left lying moving movable portable packed sealed taped damaged broken dirty
    clean random generic plain young elderly male female unknown unidentified strange
    shipping packing moving delivery shoe gift lunch pizza standing sitting walking running waiting
    talking sleeping passing blurred blurry partial hidden visible same"""
)
"""Words that say how many there are or what they look like, and not what they are for."""

VEHICLES = _words(
    """vehicle vehicles car cars truck trucks lorry lorries van vans bus buses forklift forklifts
    bicycle bicycles bike bikes motorcycle motorcycles motorbike motorbikes scooter scooters
    ambulance ambulances tractor tractors cart carts trolley trolleys train trains tram trams robot
    robots agv agvs amr amrs taxi taxis pallet-truck wagon wagons"""
)
UNDERWAY = _words(
    "passing moving driving approaching oncoming speeding reversing turning overtaking rolling "
    "travelling traveling leaving arriving crossing"
)

PHANTOMS = _words("reflection reflections shadow shadows glare silhouette silhouettes")
VAGUE = _words("object objects thing things item items stuff something shape shapes blob blobs")
"""Words that name nothing."""

COUNTED_BY = _words(
    """group groups pair pairs couple row rows stack stacks pile piles heap heaps bunch crowd lot
    lots number line lines queue set sets collection cluster clusters handful dozen dozens plenty
    flock herd swarm pack"""
)
"""Before "of", they only count what follows."""

ENDS_OF_HEADS = _words(
    """with without of in on at by near beside besides behind before under underneath below above
    over between among inside outside against along across around next close opposite from to into
    onto toward towards through for beyond past and or but who which that whose where while as is
    are was were has have being seen holding wearing using carrying pushing pulling wears holds
    stands sits walks"""
)
"""Behind these, another thing or a deed is spoken of."""

STANCES = _words(
    """standing sitting walking running waiting talking working looking lying leaning kneeling
    sleeping crouching riding driving passing moving approaching reading eating drinking playing
    flying speeding reversing turning rolling parked reflected stacked piled placed left seated"""
)
"""Deeds that also stand before things: "man waiting" is a man, "passenger waiting room" a room."""

DETERMINERS = _words("a an the this that these those his her its their my your our")
FOLLOWS_A_DEED = DETERMINERS | _words(
    """by past through along across away around about over
    toward towards to from in on at near beside behind between with without under against into
    alone together here there now slowly quickly fast left right down up and while"""
)
"""What follows a deed and never stands before the word that it describes."""

CARRIERS = (
    "sign",
    "signboard",
    "label",
    "poster",
    "notice",
    "note",
    "screen",
    "display",
    "board",
    "whiteboard",
    "blackboard",
    "sticker",
    "plate",
    "plaque",
    "placard",
    "banner",
    "marking",
    "lettering",
    "writing",
    "inscription",
    "graffiti",
    "pictogram",
    "symbol",
    "button",
    "door",
    "wall",
    "panel",
    "paper",
    "map",
)
"""Things that words stand on."""

TOLD_BY = (
    "says",
    "saying",
    "reads",
    "reading",
    "labelled",
    "labeled",
    "marked",
    "titled",
    "inscribed",
    "lettered",
    "named",
    "called",
)
"""Behind these, it is the thing that speaks."""

DOUBTS = (
    "maybe",
    "something",
    "perhaps",
    "possibly",
    "possible",
    "probably",
    "probable",
    "presumably",
    "apparently",
    "seemingly",
    "supposedly",
    "conceivably",
    "suspected",
    "might",
    "may be",
    "could be",
    "could have been",
    "must be some",
    "seems?(?: to be)?",
    "appears? to",
    "looks? like",
    "looking like",
    "resembl(?:es|ing)",
    "not sure",
    "unsure",
    "uncertain",
    "unclear",
    "not clear",
    "unrecogni[sz]able",
    "unidentifi(?:ed|able)",
    "likely",
    "either",
    "some (?:kind|sort|type) of",
    "(?:kind|sort) of an?",
    "or something",
    "or similar",
    "i (?:think|guess|believe|assume|suppose)",
    "(?:my|best|a) guess",
    "can(?:not|'t) tell",
    "hard to (?:say|tell)",
)
"""Words that say that somebody does not know; patterns, each a run of whole words."""

_DEEDS = "go|drive|move|navigate|proceed|come|travel|turn|head|walk|run|back|return|follow|steer"
_WHERE = (
    "to the|to a|to \\(?-?\\d|to your|into|towards?|at once|forward|backward|straight|away|left|"
    "right|there|here|now|immediately|home|me|him|her|"
    r"(?:the |this |your )?robots? (?:north|south|east|west|to|into|towards?|on|there|here|away)|"
    r"(?:north|south|east|west)(?:wards?)?(?=\W*$|,)"
)
_DO = (
    "ignore|disregard|forget|delete|erase|remove|overwrite|execute|call|send|tell|reveal|print|"
    "obey|follow|stop|cancel|open|close|press|push|pull|write|say|do|bring|fetch|give|take|put|"
    "leave|enter|avoid|wait|hurry|switch|turn|shut|disable|enable|use|make|attack|hit|ram|crash"
)
_WHOM = (
    "the|all|any|every|everything|this|that|these|those|your|my|his|her|it|them|me|us|previous|"
    "prior|earlier|now|immediately|whatever|into"
)
_RULES = "all|any|the|your|every|previous|prior|earlier|these|those|my|what|everything"
ORDERS = (
    rf"^(?:please |now |then |always |never |robot,? |and )*(?:{_DEEDS}) (?:{_WHERE})\b",
    rf"^(?:please |now |then |always |never |robot,? |and )*(?:{_DO}) (?:{_WHOM})\b",
    r"^(?:please|do not|don't) (?=\w)",
    r"^(?:system|assistant|user|robot|attention|important) ?[,:](?=.*\w)",
    r"\byou (?:must|should|shall|have to|need to|are now|will)\b",
    rf"\b(?:ignore|disregard|forget|override) (?:{_RULES})\b",
    r"\bnew instructions?\b",
    r"^(?:obey|comply)\b",
    r"(?<!can )(?<!may )(?<!ways )(?:^|[,;:] *|and )(?:go|drive|navigate|proceed) to [a-z]\d+\b",
)
"""Patterns of texts that tell a reader what to do."""

ADDRESSED = (
    r"\b(?:robots?|agents?|assistants?|machines?) "
    r"(?:must|should|shall|(?:have|has|need|needs|are|is) to)\b"
)
"""A pattern of texts that tell a robot what to do, whatever they stand on."""
