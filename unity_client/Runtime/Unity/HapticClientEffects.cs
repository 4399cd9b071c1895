using HapticVLM.Wire;

namespace HapticVLM
{
    public sealed partial class HapticClient
    {
        /// <summary>
        /// Plays on one hand what this gesture on this material feels like: for what is no collider. A
        /// strike is Play("wood", HandGesture.Strike, HandSide.Right). False when nothing is felt.
        /// </summary>
        public bool Play(string material, HandGesture gesture, HandSide hand, float speedMps = 0.5f, float forceN = 2f, float seconds = 0.25f)
        {
            if (!IsOwner || !UnknownMaterials.Check(material, connection, this)) return false;
            string id = WireText.Within("effect " + material, SceneObject.ObjectIdMaxLength);
            connection.Outbox.Scene.Put(new SceneObject { ObjectId = id, Material = material });
            Interaction interaction = HandGestures.OnWire(gesture) ?? Interaction.Tap;
            var effect = new HandEffect { ObjectId = id, Interaction = interaction, SpeedMps = speedMps, ForceN = forceN, Until = Clock.Now + seconds };
            HandGroup.Of(hand).Touches.Play(effect, connection);
            return true;
        }

        /// <summary>Whether an effect of Play goes on for this hand.</summary>
        public bool IsPlaying(HandSide hand)
        {
            return HandGroup.Of(hand).Touches.IsPlaying;
        }
    }
}
