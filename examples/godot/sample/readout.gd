extends Label
## Shows the service's decisions and outputs as text.

@export var hand: HapticHand
@export var pulses: HapticPulses

var _plate := "-"


func _ready() -> void:
	HapticService.current.measured.connect(_measure)


func _process(_delta: float) -> void:
	var bar := "|".repeat(roundi(40.0 * pulses.amplitude))
	var by := HapticService.current.by
	text = "%s\nvibration (%s) %s\nplate %s\n%s" % [_felt(), by, bar, _plate, _silence()]


func _felt() -> String:
	if hand.object == null:
		return "Point at an object and hold the left mouse button to touch it."
	var decision: Dictionary = HapticService.current.decisions.get(hand.object.object_id, {})
	if decision.is_empty():
		return "%s: not decided yet" % hand.object.get_parent().name
	var confidence := 100.0 * float(decision["confidence"])
	return (
		"%s: %s, %.0f %% sure, by %s; %.1f m/s"
		% [
			hand.object.get_parent().name,
			decision["material"],
			confidence,
			decision["source"],
			hand.speed_mps
		]
	)


func _measure(telemetry: Dictionary) -> void:
	var plate: Variant = telemetry.get("plate_c")
	_plate = "no reading" if plate == null else "%.1f degC" % plate


func _silence() -> String:
	var reason := HapticService.current.silence()
	return "" if reason.is_empty() else "Nothing is felt: %s." % reason
