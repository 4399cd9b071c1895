using System;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// A hand or a finger that feels. Put it beside a trigger collider and a kinematic Rigidbody, as
    /// physics needs one to report: what they meet becomes approach, contact, slide, release. Several
    /// of one side, as on the fingers of a hand, are one touch.
    /// </summary>
    [DisallowMultipleComponent, DefaultExecutionOrder(100), AddComponentMenu("HapticVLM/Haptic Hand")]
    public sealed class HapticHand : MonoBehaviour
    {
        const float ApproachPeriodS = 0.1f;
        const int MostNear = 256;

        [SerializeField]
        HandSide hand = HandSide.Right;

        [SerializeField, Tooltip("How this hand acts. By speed: press, tap or strike at contact, then slide.")]
        HandGesture gesture;

        [SerializeField, Range(0f, 0.5f), Tooltip("An object this near is about to be touched, m; 0: never.")]
        float approachM = 0.4f;

        [SerializeField, Tooltip("Layers of what can be felt.")]
        LayerMask touchableLayers = ~0;

        [SerializeField, Range(0f, 50f), Tooltip("Triggers report no force: newtons per m/s of the hand. A guess; tune it to your hand.")]
        float newtonsPerMps = 4f;

        readonly HandMotion motion = new HandMotion();
        Collider[] found = new Collider[32];
        HandGroup group;
        Collider nearCollider;
        Collider pushed;
        double pushN;
        float searchAt;

        /// <summary>The object this hand touches, by any finger; null when none.</summary>
        public string TouchedObjectId { get { return group == null ? null : group.Touches.ObjectId; } }

        /// <summary>Speed against what is touched or near, else through the world, m/s.</summary>
        public double SpeedMps { get { return motion.SpeedMps; } }

        public HandSide Side { get { return hand == HandSide.Left ? HandSide.Left : HandSide.Right; } }

        /// <summary>How this hand acts: set Carve while a knife is held, Swing while a bat is swung.</summary>
        public HandGesture Gesture
        {
            get { return gesture; }
            set { gesture = value; }
        }

        /// <summary>What this hand holds and swings: its material is what a swing is felt by.</summary>
        public HapticObject Swung { get; set; }

        /// <summary>Why physics reports no touch of this hand, and the cure; null when all is well.</summary>
        public string Problem
        {
            get
            {
                var touching = GetComponent<Collider>();
                if (touching == null && GetComponent<Rigidbody>() != null) touching = GetComponentInChildren<Collider>();
                if (touching == null) return "it has no collider: add a Sphere Collider of 2 cm radius and tick Is Trigger";
                var body = GetComponentInParent<Rigidbody>();
                if (body == null) return "it has no Rigidbody, so physics reports no touch: add one and tick Is Kinematic";
                if (body.isKinematic && !touching.isTrigger) return "a kinematic Rigidbody does not collide with things that stand still: tick Is Trigger on the collider";
                return null;
            }
        }

        internal void Belong(HandSide side)
        {
            hand = side;
        }

        internal HapticObject Near { get; private set; }

        internal double NearM { get; private set; }

        internal double ClosingMps { get; private set; }

        internal double FreeSpeedMps { get { return motion.FreeSpeedMps; } }

        static HapticConnection Link { get { return HapticClient.Active == null ? null : HapticClient.Active.Connection; } }

        void OnEnable()
        {
            group = HandGroup.Of(Side);
            group.Join(this);
            motion.Restart(transform);
        }

        void Start()
        {
            string problem = Problem ?? Surface.Ignored(gameObject.layer);
            if (problem != null) Debug.LogWarning("HapticVLM: the Haptic Hand '" + name + "' feels nothing: " + problem + ".", this);
        }

        void OnDisable()
        {
            Forget();
            group.Leave(this, Link);
        }

        void Update()
        {
            motion.Sample(transform);
            EndVanished();
            if (group.Touches.IsTouching) Forget();
            else if (approachM > 0f) Approach();
            FollowContacts();
            group.Tick(this, Link);
        }

        void OnCollisionEnter(Collision collision)
        {
            Push(collision);
            Begin(collision.collider);
        }

        void OnCollisionStay(Collision collision)
        {
            Push(collision);
        }

        void OnCollisionExit(Collision collision)
        {
            End(collision.collider);
        }

        void OnTriggerEnter(Collider other)
        {
            Begin(other);
        }

        void OnTriggerExit(Collider other)
        {
            End(other);
        }

        void Push(Collision collision)
        {
            pushed = collision.collider;
            pushN = collision.impulse.magnitude / Time.fixedDeltaTime;
        }

        void Begin(Collider other)
        {
            if (!isActiveAndEnabled) return; // the engine reports to disabled components, too
            if ((touchableLayers & 1 << other.gameObject.layer) == 0) return;
            var target = other.GetComponentInParent<HapticObject>();
            if (target == null || !target.isActiveAndEnabled) return;
            motion.Follow(other, transform.position);
            group.TakeGesture();
            group.Touches.Begin(this, other, target.ObjectId, motion.SpeedMps, ForceOn(other), Link);
        }

        void End(Collider other)
        {
            group.Touches.End(this, other, Link);
            if (other == pushed) pushed = null;
            motion.Follow(LastMet(), transform.position);
        }

        void FollowContacts()
        {
            for (int i = 0; i < group.Touches.Count; i++)
            {
                if (!ReferenceEquals(group.Touches.Finger(i), this)) continue;
                object met = group.Touches.Met(i);
                group.Touches.Follow(this, met, motion.SpeedMps, ForceOn((Collider)met));
            }
        }

        double ForceOn(Collider other)
        {
            return ReferenceEquals(other, pushed) ? pushN : motion.SpeedMps * newtonsPerMps;
        }

        Collider LastMet()
        {
            for (int i = group.Touches.Count - 1; i >= 0; i--)
            {
                if (ReferenceEquals(group.Touches.Finger(i), this)) return (Collider)group.Touches.Met(i);
            }
            return null;
        }

        /// <summary>Physics reports no exit from a collider that was destroyed or switched off.</summary>
        void EndVanished()
        {
            for (int i = group.Touches.Count - 1; i >= 0; i--)
            {
                if (!ReferenceEquals(group.Touches.Finger(i), this)) continue;
                var met = (Collider)group.Touches.Met(i);
                if (met == null || !met.enabled || !met.gameObject.activeInHierarchy) End(met);
            }
        }

        void Forget()
        {
            nearCollider = null;
            Near = null;
        }

        void Approach()
        {
            if (Time.unscaledTime >= searchAt)
            {
                searchAt = Time.unscaledTime + ApproachPeriodS;
                FindNearest();
                motion.Follow(nearCollider, transform.position);
            }
            if (nearCollider == null || Near == null || !Near.isActiveAndEnabled) Forget();
            else Measure();
        }

        void Measure()
        {
            Vector3 position = transform.position, point;
            if (!Surface.Nearest(nearCollider, position, motion.FreeVelocity, approachM, out point)) return; // as it was
            NearM = (point - position).magnitude;
            ClosingMps = motion.ClosingMps(position, point);
        }

        void FindNearest()
        {
            Vector3 position = transform.position;
            int count = Physics.OverlapSphereNonAlloc(position, approachM, found, touchableLayers);
            if (count == found.Length && count < MostNear) Array.Resize(ref found, 2 * count);
            Forget();
            float least = float.PositiveInfinity;
            for (int i = 0; i < count; i++)
            {
                Vector3 point;
                if (!Surface.Nearest(found[i], position, motion.FreeVelocity, approachM, out point)) continue;
                float distance = (point - position).sqrMagnitude;
                if (distance >= least) continue;
                var candidate = found[i].GetComponentInParent<HapticObject>();
                if (candidate == null || !candidate.isActiveAndEnabled) continue;
                Near = candidate;
                nearCollider = found[i];
                least = distance;
            }
        }
    }
}
