using HapticVLM.Wire;

namespace HapticVLM
{
    public sealed partial class HapticClient
    {
        /// <summary>
        /// Plays this gesture on this material on one hand, for events without a collider. A strike on wood
        /// is Play("wood", HandGesture.Strike, HandSide.Right). Returns false if nothing is played.
        /// </summary>
        public bool Play(string material, HandGesture gesture, HandSide hand, float speedMps = 0.5f, float forceN = 2f, float seconds = 0.25f)
        {
            bool isBaked = IsBaked(hand);
            if (!isBaked && (!IsOwner || !UnknownMaterials.Check(material, connection, this))) return false;
            string id = WireText.Within("effect " + material, SceneObject.ObjectIdMaxLength);
            surfaces.Play(id, material);
            if (connection != null) connection.Outbox.Scene.Put(new SceneObject { ObjectId = id, Material = material });
            Interaction interaction = HandGestures.OnWire(gesture) ?? Interaction.Tap;
            var effect = new HandEffect { ObjectId = id, Interaction = interaction, SpeedMps = speedMps, ForceN = forceN, Until = Clock.Now + seconds };
            HandGroup.Of(hand).Touches.Play(effect, connection);
            return true;
        }

        /// <summary>Whether an effect started by Play is still playing on this hand.</summary>
        public bool IsPlaying(HandSide hand)
        {
            return HandGroup.Of(hand).Touches.IsPlaying;
        }
    }
}
